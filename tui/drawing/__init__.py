"""Drawing in characters: colours, strips, and the canvas of the map."""
