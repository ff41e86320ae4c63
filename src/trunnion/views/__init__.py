"""Results shown: figures (`plots`), one self-contained HTML page (`report`), plain data for a browser (`scene`).

Every view takes the Dataset of an analysis and, if wanted, that of the same run without friction. `plots` imports
matplotlib; import it only where a figure is asked for.
"""
