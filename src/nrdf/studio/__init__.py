"""The studio: paint regions, describe their processes and transfer them, in a browser.

In: a reference, targets and the inputs of a person. Out: a saved session, and what the command
line reads: knowledge, jobs, robot programs, simulations. `model` knows nothing of the browser;
`scene` and `panels` show it with viser; `app` puts them together.
"""
