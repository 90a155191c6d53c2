"""The studio's state and computing, without a browser.

In: what a person loads, paints and enters. Out: a saved session, plans, transfer results, robot
simulations and the files that the command line reads.
"""
