"""The command line's verbs, one function each; what they need is imported when they run."""
