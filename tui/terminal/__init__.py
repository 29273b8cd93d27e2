"""The terminal below the dashboard: cells already shown, its character set, stalls and crashes."""
