"""Do axes and signs of a log belong together?"""
