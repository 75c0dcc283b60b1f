"""Rows of lists, trees and graphs."""
