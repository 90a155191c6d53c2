"""What is written about a transfer.

In: a `TransferResult` of `nrdf.process`, and limits on it.
Out: a report as plain values, as one HTML file, and a job folder with tool paths and pictures.
"""
