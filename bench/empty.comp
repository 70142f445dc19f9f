// Does nothing: what is left is the cost of a dispatch.
#version 450

void main() {}
