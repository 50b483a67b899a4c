"""Generated from proto/rpc/v1/policy.proto: `make proto` writes it, a test compares."""
