"""What several stages share: neighbours, circle and cylinder fits, frames, Douglas-Peucker."""
