"""Style reward: a discriminator of transitions, in process or as a gRPC service."""
