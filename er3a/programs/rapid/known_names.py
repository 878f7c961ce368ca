"""The instructions and functions of RAPID's controllers, by what is known of each: exact names, in capitals."""

from __future__ import annotations

from collections.abc import Container, Mapping

from er3a.programs import syntax
from er3a.programs.evaluation import variable_of

LATE = "%LATE"
"""A call by a text that names no procedure of the program."""
CHANGING = {
    "TPREADNUM": 0,
    "TPREADFK": 0,
    "TPREADDNUM": 0,
    "GETSYSDATA": 0,
    "GETDATAVAL": 1,
    "BITCLEAR": 0,
    "BITSET": 0,
    "WAITTESTANDSET": 0,
    "IVARVALUE": 2,
    "SETUPCYCLICBOOL": 0,
}
"""Instructions that change one of their arguments, by its number."""
CHANGING_OPTIONS = frozenset(("TIMEFLAG", "VALUE", "VALUEATTIMEOUT", "BREAKFLAG", "ERRORNUMBER", "RESULT"))
"""Optional arguments that instructions and functions change."""
READING = (
    *("READ", "GET", "UNPACK", "RMQGET", "RMQREAD", "RMQSENDWAIT", "SOCKETRECEIVE", "SOCKETACCEPT", "UIMSGBOX"),
    *("PACK", "COPYRAW"),
)
"""How instructions begin that may change any variable that they are given."""
CHANGING_FUNCTIONS = {"STRTOVAL": 1, "TESTANDSET": 0, "GETNEXTSYM": 0, "GETNEXTMECHUNIT": 1, "READDIR": 1}
"""Functions that change one of their arguments, by its number."""
WAITS = frozenset(
    (
        *("WAITDI", "WAITDO", "WAITAI", "WAITAO", "WAITGI", "WAITGO", "WAITUNTIL", "WAITSYNCTASK", "WAITTESTANDSET"),
        *("WAITROB", "WAITLOAD", "WAITSENSOR", "WAITWOBJ"),
    )
)
NOT_SIMULATED_TEXT = """
ACTUNIT CIRPATHMODE CORRCON CORRWRITE DEACTUNIT DROPWOBJ EOFFSON EOFFSSET INDAMOVE INDCMOVE INDDMOVE INDRESET
INDRMOVE MOTIONPROCESSMODESET MOVEEXTJ PATHRESOL SINGAREA SOFTACT SOFTDEACT SPEEDREFRESH SUPSYNCSENSOROFF
SUPSYNCSENSORON SYNCMOVEOFF SYNCMOVEON SYNCMOVERESUME SYNCMOVESUSPEND SYNCMOVEUNDO SYNCTOSENSOR TRIGGSPEED
WAITSYNCTASK WAITWOBJ WZBOXDEF WZCYLDEF WZDISABLE WZDOSET WZENABLE WZFREE WZHOMEJOINTDEF WZLIMJOINTDEF WZLIMSUP
WZSPHDEF
"""
NOT_SIMULATED = frozenset(NOT_SIMULATED_TEXT.split())
"""What is known to shape a motion or to move something else, and is not followed: it is named."""
FOLLOWED: Mapping[str, tuple[set[str], ...]] = {
    "SINGAREA": ({"OFF"},),
    "CIRPATHMODE": (set(), {"PATHFRAME"}, {"OBJECTFRAME"}),
}
"""Options with which some of these are followed. CirPathMode: an arc turns the tool with the path, as where nothing is
said, or about one axis."""
SETTINGS = {
    **{name: f"%{name}" for name in ("CONFJ", "CONFL")},
    **{"ACCSET": "%ACC", "VELSET": "%SPEED", "CIRPATHMODE": "%ARCS"},
    **dict.fromkeys(("PDISPSET", "PDISPON", "PDISPOFF"), "%PDISP"),
}
"""Instructions that later motions depend on, and that are followed, with the name under which each is kept."""
OUTPUTS = frozenset(
    (
        *(
            "SETDO",
            "SETAO",
            "SETGO",
            "SET",
            "RESET",
            "PULSEDO",
            "INVERTDO",
        ),
        *("MOTIONSUP", "TRIGGIO", "TRIGGEQUIP", "TRIGGINT", "TRIGGSPEED", "TRIGGCHECKIO", "TRIGGRAMPAO"),
    )
)
HARMLESS_TEXT = """
PATHACCLIM WORLDACCLIM
ACTEVENTBUFFER ALIASIO BITCLEAR BITSET BOOKERRNO CANCELLOAD CLEARIOBUFF CLEARRAWBYTES CLKRESET CLKSTART
CLKSTOP CLOSE
CORNERPATHWARNING EGMGETID EGMRESET
CLOSEDIR COPYFILE COPYRAWBYTES DEACTEVENTBUFFER ERRLOG ERRRAISE ERRWRITE EXITCYCLE FRICIDINIT GETDATAVAL GETSYSDATA
GETTRAPDATA IDELETE IDISABLE IENABLE IERROR INVERTDO IODISABLE IOENABLE IPERS IRMQMESSAGE ISIGNALAI
ISIGNALAO ISIGNALDI ISIGNALDO ISIGNALGI ISIGNALGO ISLEEP ITIMER IVARVALUE IWATCH LOAD MAKEDIR MECHUNITLOAD MOTIONSUP
OPEN OPENDIR PACKDNHEADER PACKRAWBYTES PDISPOFF PROCERRRECOVERY PULSEDO READANYBIN READBLOCK READCFGDATA READERRDATA
READRAWBYTES REMOVEDIR REMOVEFILE RENAMEFILE RESET RESETPPMOVED RESETRETRYCOUNT RESTOPATH REWIND RMQEMPTYQUEUE
RMQFINDSLOT RMQGETMESSAGE RMQGETMSGDATA RMQGETMSGHEADER RMQREADWAIT RMQSENDMESSAGE RMQSENDWAIT SAVE SAVECFGDATA
SENDMESSAGE SET SETAO SETDATASEARCH SETDO SETGO SKIPWARN SOCKETACCEPT SOCKETBIND SOCKETCLOSE SOCKETCONNECT
SOCKETCREATE SOCKETLISTEN SOCKETRECEIVE SOCKETRECEIVEFROM SOCKETSEND SOCKETSENDTO SPYSTART SPYSTOP STARTLOAD STOREPATH
TEXTTABINSTALL TPERASE TPREADDNUM TPREADFK TPREADNUM TPSHOW TPWRITE TRIGGCHECKIO TRIGGEQUIP TRIGGINT TRIGGIO
TRIGGRAMPAO TRIGGSPEED TRYINT UIMSGBOX UIMSGWRITE UIMSGWRITEABORT UISHOW UNLOAD UNPACKRAWBYTES WARMSTART
WRITE WRITEANYBIN WRITEBIN WRITEBLOCK WRITECFGDATA WRITERAWBYTES WRITESTRBIN STOPMOVE STARTMOVE STOPMOVERESET
"""
HARMLESS = frozenset(HARMLESS_TEXT.split())
"""Instructions that move nothing and set nothing that motions depend on (1, by their names)."""
SHIFTING = frozenset(
    (
        *("CORRCON", "CORRWRITE", "SYNCTOSENSOR", "INDAMOVE", "INDCMOVE", "INDDMOVE", "INDRMOVE", "SOFTACT"),
        *("SINGAREA", "SYNCMOVEON", "WAITWOBJ"),
    )
)
"""Instructions of these after which the arm may go otherwise than its targets say."""
PARAMETERS: Mapping[str, int] = {
    **{"OFFS": 4, "RELTOOL": 4, "POSEMULT": 2, "POSEINV": 1, "POSEVECT": 2, "ORIENTZYX": 3, "EULERZYX": 1},
    **{"NORIENT": 1, "DEFFRAME": 3, "DISTANCE": 2, "CROBT": 0, "CJOINTT": 0, "CPOS": 0},
    **{"ABS": 1, "SQRT": 1, "SIN": 1, "COS": 1, "TAN": 1, "ASIN": 1, "ACOS": 1, "ATAN": 1, "ATAN2": 2, "POW": 2},
    **{"EXP": 1, "TRUNC": 1, "ROUND": 1, "DIM": 2, "PRESENT": 1, "NUMTODNUM": 1, "DNUMTONUM": 1},
}
"""Functions that are evaluated, with the number of their arguments."""
ASKED_TEXT = """
AINPUT AOUTPUT DINPUT DOUTPUT GINPUT GOUTPUT TESTDI TESTANDSET CLKREAD CDATE CTIME GETTIME CSPEEDOVERRIDE ISPERS ISVAR
ISSTOPMOVEACT OPMODE RUNMODE ROBOS ROBNAME TASKRUNROB TASKRUNMEC GETTASKNAME GETMECUNITNAME GETNEXTMECHUNIT ISSYSID
ISMECHUNITACTIVE ISFILE FILESIZE FSSIZE READBIN READDIR READMOTOR READNUM READSTR READSTRBIN READVAR SOCKETGETSTATUS
SOCKETPEEK UIALPHAENTRY UICLIENTEXIST UIDNUMENTRY UIDNUMTUNE UILISTVIEW UIMESSAGEBOX
UINUMENTRY UINUMTUNE GETSIGNALORIGIN IOUNITSTATE VALIDIO EVENTTYPE EXECHANDLER EXECLEVEL MOTORTEMP
NONMOTIONMODE PATHLEVEL PPMOVEDINMANMODE RAWBYTESLEN RMQGETSLOTNAME TASKS TYPE TRIGGDATAVALID ARGNAME CSPEED
GETAXISDISTANCE GETMAXNUMBEROFCYCLICBOOL GETNEXTSYM GETSYSINFO GETMODALPAYLOADMODE
"""
ASKED = frozenset(ASKED_TEXT.split())
"""Functions whose value only the running cell knows."""
OTHER_TEXT = """
BITAND BITCHECK BITLSH BITNEG BITOR BITRSH BITXOR BYTETOSTR CALCJOINTT CALCROBT CTOOL CWOBJ DECTOHEX DOTPROD HEXTODEC
MIRPOS NUMTOSTR STRDIGCALC STRDIGCMP STRFIND STRFORMAT STRLEN STRMAP STRMATCH STRMEMB STRORDER STRPART STRTOBYTE
STRTOVAL VALTOSTR VECTMAGN
"""
NOT_EVALUATED = frozenset(OTHER_TEXT.split())
"""Functions whose value follows from their arguments alone, and that are not evaluated."""


def is_known(name: str) -> bool:
    """Whether it is known of an instruction or function, which the program does not hold, what it does."""
    if (name[:1] == "%" and name != LATE) or name in SETTINGS or name in OUTPUTS or name in ("GRIPLOAD", "SETSYSDATA"):
        return True
    evaluated = name in PARAMETERS or name in NOT_EVALUATED
    return (
        evaluated or name in HARMLESS or name in ASKED or name in NOT_SIMULATED or name in WAITS or name == "EOFFSOFF"
    )


def changed_arguments(call: syntax.Invocation, fixed: Container[str]) -> list[syntax.Expression]:
    """What a function that the program does not hold changes of its arguments, or may change if it is not known.

    ``fixed``: names of constants.
    """
    known = is_known(call.function)
    at = CHANGING_FUNCTIONS.get(call.function) if known else None
    by_name = [each for key, each in call.keywords if not known or key in CHANGING_OPTIONS]
    placed = call.arguments if not known else () if at is None else call.arguments[at : at + 1]
    given = [each for each in (*placed, *by_name) if each is not None]
    return [each for each in given if (name := variable_of(each)) and name not in fixed]
