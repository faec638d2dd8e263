"""Output for readers: figures, the summary of one result file, the HTML report."""
