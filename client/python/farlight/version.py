# SPDX-License-Identifier: MIT
"""The version of farlight that this package belongs to; generate.py sees that it is that of protocol/version.h."""
VERSION = "0.1.0"
