"""Lines on the floor for `follow_line`: traced through pictures, and steering along them."""
