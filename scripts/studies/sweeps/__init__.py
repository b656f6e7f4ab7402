"""What batches and sweeps of many walks cost, here and on many cores."""
