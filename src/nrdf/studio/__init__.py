"""The studio: paint regions, describe their processes and see them on other objects, in a browser.

State and its changes (`session`, `painting`, `view`, `teaching`, `saving`) know nothing of the
browser; `app` and the panels show them with viser. Whatever is computed is computed by the
functions that the command line uses.
"""
