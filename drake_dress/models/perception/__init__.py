"""What is made of cameras' images."""
