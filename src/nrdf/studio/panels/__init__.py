"""The studio's panel: one module a tab, in the order of the steps.

In: clicks and values from a browser. Out: changes of the session, and what the panel shows.
"""
