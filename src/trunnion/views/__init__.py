"""Results shown: a file a result, each with its `tables`, its `figure` as a `Plot`, and its `report` as one HTML page.

What is drawn is data (`charts`, `page`); `draw` draws it by matplotlib, which is slow to import and imported only then.
"""
