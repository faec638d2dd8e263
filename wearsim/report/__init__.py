"""What people read: figures, the summary of one result file, the HTML report."""
