"""Motion in time: drivers whose motion is found from what drives them."""
