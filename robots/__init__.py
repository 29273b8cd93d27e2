"""Robot descriptions and the bodies that move them."""
