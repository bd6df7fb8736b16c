"""Identification: from manoeuvres in flight records to models with their uncertainty."""
