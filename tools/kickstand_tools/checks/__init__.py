"""Checks a log and returns remarks as data. Each remark is a Message with its fields, its text and a remedy."""
