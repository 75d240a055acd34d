"""Scenarios, stations and the dressing diagram."""
