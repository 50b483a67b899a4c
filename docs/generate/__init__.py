"""The reference pages, written from the code while the site is built."""
