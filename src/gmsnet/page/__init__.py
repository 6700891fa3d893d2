"""One HTML file that shows a mesh before and after smoothing: numbers, a picture to turn and zoom, histograms.

It needs nothing but a browser: no library, no request, and a policy that forbids both.
"""

from gmsnet.page.contents import Contents, Grid
from gmsnet.page.write import check_page, write_page

__all__ = ["Contents", "Grid", "check_page", "write_page"]
