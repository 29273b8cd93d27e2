"""Drafts of missions by programs: the language as a prompt, and the fixes of findings."""
