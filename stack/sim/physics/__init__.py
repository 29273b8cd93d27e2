"""The PyBullet world: meshes, wheels, contacts, friction."""
