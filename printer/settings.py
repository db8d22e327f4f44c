"""How to speak to one printer, and how to leave it safely: plain values, filled in from a profile."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Safety:
    """How the nozzle leaves and re-enters a standing print.

    ``build_axis`` is the letter of the axis along which the print grows, ``lift_mm`` how far the nozzle
    moves off along it; speeds are in mm/s. ``close_lines`` close the valve or retract (E is relative in
    them), ``open_lines`` are those with which a program opens the valve, ``stop_lines``
    are sent last at a controlled stop (heaters), ``home_lines`` may run over a standing print after the
    printer forgot its position, and ``build_axis_homes_up`` says that its endstop is on the far side.
    """

    build_axis: str = "Z"
    lift_mm: float = 10.0
    lift_speed_mm_s: float = 5.0
    travel_speed_mm_s: float = 30.0
    retract_speed_mm_s: float = 10.0
    close_lines: tuple[str, ...] = ()
    open_lines: tuple[str, ...] = ()
    stop_lines: tuple[str, ...] = ()
    home_lines: tuple[str, ...] = ()
    build_axis_homes_up: bool = False


@dataclass(frozen=True, slots=True)
class Settings:
    """Baud rate, window and timeouts (seconds), and the safe way out.

    ``window_lines`` and ``window_bytes`` bound what is sent but not acknowledged; 1 line is ping-pong.
    After ``probe_after_s`` without an answer the printer is asked (more than the 2 s between two messages
    of a busy one), after ``give_up_after_s`` in which it said nothing at all the job fails, and after
    ``stall_after_s`` in which it reported but took no line.
    ``boot_wait_s`` is the time for a board that resets when its port is opened; every ``poll_s`` the
    temperatures are asked for, and the answer tells exactly which lines were taken.
    ``emulated`` says that nothing is at stake: a command that this printer does not know ends no job, for the
    one that will print may know it.
    """

    baud: int = 115200
    window_lines: int = 4
    window_bytes: int = 127
    probe_after_s: float = 2.5
    give_up_after_s: float = 30.0
    stall_after_s: float = 600.0
    boot_wait_s: float = 3.0
    poll_s: float = 2.0
    safety: Safety = Safety()
    emulated: bool = False
