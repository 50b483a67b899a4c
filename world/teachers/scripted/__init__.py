"""The scripted teacher of carry: a whole-body controller that walks to a box, carries it and puts
it down. The teachers in the folder above follow people's motions."""
