"""Looking: pictures, markers, objects, doors."""
