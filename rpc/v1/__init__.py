"""Generated from proto/rpc/v1: `make proto` writes it, a test compares."""
