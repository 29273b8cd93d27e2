"""Commands that say what files and the catalogue contain, without running anything."""
