"""What fails with one reflector, and which reflectors matter most."""
