#!/bin/bash
# Wherever memory runs out the process ends with a sentence and status 5, whoever asked for it, a library too. A worker
# that ends so is started again; of a coordinator the journal stays good, and the same command again completes.
# `make failures` tries every allocation, which takes minutes.
. tests/fault/failing.sh

every weft memory '0|5' 97 # 0: a library can do without
every weft-worker memory 0 97

nothing_left
finish
