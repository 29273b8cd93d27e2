"""Maps: exploring, saving, loading, switching between mapping and localising."""
