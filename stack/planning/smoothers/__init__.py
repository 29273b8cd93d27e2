"""Path smoothers, chosen by name."""
