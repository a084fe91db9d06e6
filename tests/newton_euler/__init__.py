"""Equations of motion written by hand from Newton's and Euler's laws, in numpy: nothing here comes from gaitopt."""
