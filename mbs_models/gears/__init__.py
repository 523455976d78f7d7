"""Gears at work: operating points, orders, sidebands, resonances."""
