"""The style reward: a discriminator of motion in its scene, in process or as a gRPC service."""
