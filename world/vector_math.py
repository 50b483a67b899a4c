"""Elementary functions of torch that are right from their first call on.

MKL's vector mathematics, by which torch takes cosines, roots and exponentials on Intel's
processors, is not initialised safely by two threads at once: in up to two of five processes the
half of a tensor that one thread took in the very first call came out wrong by up to 2e-4 (torch
2.13.0, MKL 2024.2). Reference states differed by it, and the last bits of about one training in a
hundred.
Importing this module makes that first call, in one thread.
"""

import torch

# Fewer elements than are shared between threads.
torch.zeros(8).cos()
