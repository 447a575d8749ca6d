#!/bin/bash
# Whatever operation fails on files, connections or processes: the right picture or a sentence and a status other than
# 0; never a hole, and the same command again completes what is missing.
. tests/fault/failing.sh

# --- files: the coordinator's alone ---------------------------------------------------------------------------
every weft open '3|4'
every weft write 4
every weft sync 4
every weft name 4

# --- connections ----------------------------------------------------------------------------------------------
# A worker notices with its next beat, so each takes up to a second.
for program in weft weft-worker; do
    every $program send 0 7
    every $program receive 0 7
done
every weft descriptor '1|5' 5
every weft-worker descriptor 0 5

# --- processes and threads ------------------------------------------------------------------------------------
every weft process 5
every weft thread 5
every weft-worker thread 0

nothing_left
finish
