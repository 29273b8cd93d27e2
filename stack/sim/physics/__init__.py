"""PyBullet physics: meshes, wheels, contacts, friction."""
