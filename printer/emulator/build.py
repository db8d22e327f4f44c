"""How an emulated printer is built: buffers, delays, features, and what goes wrong."""

from dataclasses import dataclass, field

from printer.emulator.faults import Faults
from printer.emulator.motion import Motion


@dataclass
class Options:
    """How the printer is built: ``slots`` commands are queued, ``rx`` bytes wait behind them, ``blocks``
    moves are planned. Each command takes at least ``command_s`` and each reply ``delay_s`` on its way.
    ``odd`` names the ways in which it words its answers otherwise, see ``odd.py``."""

    slots: int = 4
    rx: int = 128
    blocks: int = 16
    command_s: float = 0.0
    delay_s: float = 0.0
    homing_s: float = 28.0
    advanced_ok: bool = False
    emergency_parser: bool = False
    keep_path: bool = True
    odd: frozenset[str] = frozenset()
    motion: Motion = field(default_factory=Motion)
    faults: Faults = field(default_factory=Faults)
