"""The simulated world: character, motions, furniture, tasks and scenes."""

from world.surroundings import settle_gl

# before anything imports MuJoCo, which fails with an OpenGL that is not there
settle_gl()
