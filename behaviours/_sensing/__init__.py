"""What behaviours read off scans and pictures: walls, doorways, docks, objects, and poses."""
