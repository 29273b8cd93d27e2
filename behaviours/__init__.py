"""Built-in behaviours, and the base class for behaviours of your own."""
