"""Robot descriptions, their reader, and the bodies."""
