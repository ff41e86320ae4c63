"""What a figure shows, as the tests of the views ask it: curves, legends, texts, and what lies beyond its edge."""

from matplotlib.axis import Tick
from matplotlib.text import Text


def outside(figure):
    """Texts that lie beyond the edge of a figure."""
    figure.canvas.draw()
    ticks = {id(text) for tick in figure.findobj(Tick) for text in (tick.label1, tick.label2)}
    seen = [tick.label1 for axes in figure.axes for axis in (axes.xaxis, axes.yaxis) for tick in axis.get_major_ticks()
            if axis.get_view_interval().min() <= tick.get_loc() <= axis.get_view_interval().max()]  # fmt: skip
    texts = [*(text for text in figure.findobj(Text) if id(text) not in ticks), *seen]
    boxes = [(text.get_text(), text.get_window_extent()) for text in texts if text.get_visible()]
    width, height = figure.bbox.width, figure.bbox.height
    return [text for text, box in boxes
            if text.strip() and (box.x0 < -1 or box.y0 < -1 or box.x1 > width + 1 or box.y1 > height + 1)]  # fmt: skip


def line(axes, start):
    """The curve whose label starts so."""
    return next(curve for curve in axes.lines if str(curve.get_label()).startswith(start))


def labels(axes):
    """The entries of a legend."""
    return [text.get_text() for text in axes.get_legend().get_texts()]


def texts(axes):
    """What is written in the frame."""
    return [text.get_text() for text in axes.texts]
