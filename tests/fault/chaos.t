#!/bin/bash
# A short one of `make chaos`, another one in every run; its seed is printed.
exec tests/fault/chaos 6
