"""Reports: gaits as one self-contained page, and as what a notebook shows of them."""
