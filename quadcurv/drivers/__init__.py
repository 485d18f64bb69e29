"""What runs a scheme on a mesh."""
