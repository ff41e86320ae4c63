"""The studio: a local web application in which a mechanism is drawn, dragged and looked at; all physics in Python."""
