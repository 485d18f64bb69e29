"""Compiled loops: plain arrays in and out, no mesh class, no policy."""
