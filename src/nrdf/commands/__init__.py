"""The verbs of the command line: words in, files and tables out, one verb per module.

What a verb needs is imported when it runs, so `nrdf --help` needs no torch.
"""
