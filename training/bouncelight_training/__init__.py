"""Trains bouncelight's networks: pairs of rasterised features and path-traced light in, a weights file out."""
