"""Does an alignment that is there already fit what driving shows?"""
