"""Airborne tiles: vegetation, single trees and their inventory, a cell of the national grid at a time."""
