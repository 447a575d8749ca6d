# $version: the one that the Makefile has, where all others come from.
# shellcheck shell=bash disable=SC2034
version=$(sed -n 's/^VERSION = //p' Makefile)
