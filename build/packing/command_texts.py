# SPDX-License-Identifier: GPL-3.0-or-later
"""The man page and the completion of the command line. Both are made of what `patina help` and `patina help all` print."""
import re
import subprocess
from dataclasses import dataclass
from pathlib import Path


@dataclass
class Option:
    """A line of the help: names with their values ("" without one), as printed and one by one, and what it says."""

    head: str
    names: dict[str, str]
    about: str

    def choices(self, name: str) -> list[str]:
        """Words that the value may be, as far as the help lists them."""
        value = self.names[name].split("[")[0]
        if "|" in value:
            return [word for word in value.split("|") if word.islower()]
        listed = re.search(r"((?:[\w-]+, )+[\w-]+ or [\w-]+)", self.about) if value == "NAME" else None
        return re.split(r", | or ", listed.group(1)) if listed else []


@dataclass
class Help:
    """commands: (usage, about) of each. topics: name → (about, options)."""

    commands: list[tuple[str, str]]
    notes: list[str]
    topics: dict[str, tuple[str, list[Option]]]

    def command_names(self) -> list[str]:
        return list(dict.fromkeys(usage.split()[1].rstrip(",") for usage, _ in self.commands))


def read(program: Path) -> Help:
    """What a program's help says."""
    def said(*arguments: str) -> list[str]:
        return subprocess.run([program, "help", *arguments], capture_output=True, text=True, check=True).stdout.splitlines()

    usage, topics, options = said(), {}, []
    commands = [found.groups() for line in usage if (found := re.fullmatch(r"(patina \w+(?: [-A-Z[]\S*)*) +(.*)", line))]
    notes = [line for line in usage if line.startswith(("Options take", "Exit status"))]
    for line in said("all"):
        heading = re.fullmatch(r"([a-z]+): (.+)", line)
        if heading:
            topics[heading.group(1)] = (heading.group(2), options := [])
        elif line.startswith("  -"):
            head, _, about = re.sub(r"(?<=\S) {2,}", "\t", line.strip(), count=1).partition("\t")
            names = {name: value.rstrip(",") for name, value in re.findall(r"(?<!\S)(--?[a-z][a-z-]*)(?: (?!-)(\S+))?", head)}
            options.append(Option(head, names, about))
        elif line.strip():
            options[-1].about += " " + line.strip()
    return Help(commands, notes, topics)


# ---- the man page ---------------------------------------------------------------------------------------------------------


def _roff(text: str) -> str:
    text = text.replace("\\", "\\e").replace("-", "\\-")
    return "\\&" + text if text.startswith((".", "'")) else text


def _bold(head: str) -> str:
    """Names of options in bold."""
    return re.sub(r"(?<!\S)(\\-[\\a-z-]*)", r"\\fB\1\\fR", _roff(head))


def man_page(help_: Help, version: str) -> str:
    """patina.1"""
    lines = ['.\\" Made of the text of "patina help" by build/package.', f'.TH PATINA 1 "" "Patina {version}" "User Commands"', ".SH NAME",
             "patina \\- renders point clouds as surfaces", ".SH SYNOPSIS"]
    lines += [line for usage, _ in help_.commands for line in (f".B {_roff(' '.join(usage.split()[:2]))}", _roff(" ".join(usage.split()[2:])), ".br")
              if line]
    lines[-1:] = [".SH DESCRIPTION", "Patina renders point clouds as closed surfaces. It makes no mesh: it fills, lights and smooths the points in the image.",
                  ".SH COMMANDS"]
    for usage, about in help_.commands:
        lines += [".TP", f".B {_roff(usage)}", _roff(about)]
    lines += [".SH OPTIONS", _roff(help_.notes[0])]
    for topic, (about, options) in help_.topics.items():
        lines.append(f".SS {topic}: {_roff(about)}")
        for option in options:
            lines += [".TP", _bold(option.head), _roff(option.about)]
    lines += [".SH EXIT STATUS", _roff(help_.notes[1].partition(": ")[2])]
    return "\n".join(lines) + "\n"


# ---- completion in bash and zsh --------------------------------------------------------------------------------------------

COMMANDS = ("convert", "analyse", "distance", "ground", "draw", "render", "scatter", "merge")  # that take options
SHARED = {"merge": ("-o", "--output", "--verbose")} | dict.fromkeys(("analyse", "distance", "ground"), ("-o", "--output"))  # listed once, for `render`
OF_TOPICS = {"convert": ("convert", "analyse"), "measure": ("distance", "ground"), "draw": ("draw",)}  # others: of images
FILES = re.compile(r"FILE|FOLDER|NEXT")
MADE = "Made of the text of \"patina help all\" by build/package."


def commands_of(topic: str, option: Option) -> tuple[str, ...]:
    """Commands that take an option: "merge: ..." says so in front of the explanation, else the topic."""
    named = re.match(rf"({'|'.join(COMMANDS)})\b[^:]*: ", option.about)
    return (named.group(1),) if named else OF_TOPICS.get(topic, ("render", "scatter"))


@dataclass
class Completion:
    """What a shell offers. options: command → {option: what it does}. chosen: (command, option) → words that its value may
    be. files, values: (command, option) whose value is a file, or anything else. helped: words after `patina help`."""

    options: dict[str, dict[str, str]]
    chosen: dict[tuple[str, str], list[str]]
    files: set[tuple[str, str]]
    values: set[tuple[str, str]]
    helped: list[str]


def offered(help_: Help) -> Completion:
    shared = {name: option.about for _, options in help_.topics.values() for option in options for name in option.names}
    found = Completion({command: {name: shared[name] for name in SHARED.get(command, ())} for command in COMMANDS}, {}, set(), set(), [])
    for topic, (_, options) in help_.topics.items():
        for option in options:
            commands = commands_of(topic, option)
            for name, value in option.names.items():
                for command in commands:
                    found.options[command].setdefault(name, option.about)
                if words := option.choices(name):
                    found.chosen |= {(command, name): words for command in commands}
                elif FILES.match(value):
                    found.files.update((command, name) for command in commands)
                elif value:
                    found.values.update((command, name) for command in commands)
    every = {name for options in found.options.values() for name in options}
    found.helped = ["all", *help_.topics, *sorted(name for name in every if name.startswith("--"))]
    return found


def patterns(chosen: set[tuple[str, str]], others: set[tuple[str, str]]) -> str:
    """Of a shell's `case`: any command, then one of the options. An option that means something else for another command is of its own alone."""
    elsewhere = {name for _, name in others}
    return " | ".join(sorted({f"{command if name in elsewhere else '*'}\\ {name}" for command, name in chosen}))


def bash_completion(help_: Help) -> str:
    """The function that bash calls for `patina`."""
    found = offered(help_)
    lines = [f"# Completion of the command patina in bash. {MADE}", "_patina() {",
             "    local current=${COMP_WORDS[COMP_CWORD]} option=${COMP_WORDS[COMP_CWORD - 1]} words=", "    COMPREPLY=()",
             "    if ((COMP_CWORD == 1)); then",
             f"        mapfile -t COMPREPLY < <(compgen -W '{' '.join(help_.command_names())}' -- \"$current\")", "        return", "    fi",
             "    # bash splits --name=value at the equals sign",
             "    [[ $current == = ]] && current=",
             "    [[ $option == = ]] && option=${COMP_WORDS[COMP_CWORD - 2]}",
             "    case \"${COMP_WORDS[1]} $option\" in"]
    lines += [f"    {command}\\ {name}) words='{' '.join(words)}' ;;" for (command, name), words in sorted(found.chosen.items())]
    lines += [f"    {patterns(found.files, found.values)})", "        mapfile -t COMPREPLY < <(compgen -f -- \"$current\")", "        return", "        ;;",
              f"    {patterns(found.values, found.files)}) return ;;", "    esac", "    if [[ ! $words && $current == -* ]]; then", "        case ${COMP_WORDS[1]} in"]
    lines += [f"        {command}) words='{' '.join(sorted(options))}' ;;" for command, options in found.options.items()]
    lines += ["        esac", "    fi", f"    [[ ! $words && ${{COMP_WORDS[1]}} == help ]] && words='{' '.join(found.helped)}'",
              "    if [[ $words ]]; then mapfile -t COMPREPLY < <(compgen -W \"$words\" -- \"$current\")",
              "    elif [[ $current != -* ]]; then mapfile -t COMPREPLY < <(compgen -f -- \"$current\")", "    fi", "}",
              "complete -o filenames -F _patina patina"]
    return "\n".join(lines) + "\n"


def _described(words: dict[str, str]) -> list[str]:
    """Words and what they mean, as zsh's _describe reads them, each quoted."""
    def quoted(text: str) -> str:
        return "'" + text.replace("'", "'\\''") + "'"
    return [quoted(word.replace(":", "\\:") + ":" + about) for word, about in sorted(words.items())]


def zsh_completion(help_: Help) -> str:
    """The function _patina, which zsh finds in a folder of its fpath. It shows what each command and option does."""
    found = offered(help_)
    commands = {}
    for usage, about in help_.commands:
        commands.setdefault(usage.split()[1].rstrip(","), about)
    lines = ["#compdef patina", f"# Completion of the command patina in zsh. {MADE}", "_patina() {", "    local option=${words[CURRENT - 1]}", "    local -a found",
             "    if ((CURRENT == 2)); then", "        found=(", *(f"            {word}" for word in _described(commands)), "        )",
             "        _describe command found", "        return", "    fi",
             "    if [[ $PREFIX == --*=* ]]; then", "        option=${PREFIX%%=*}", "        compset -P '*='", "    fi",
             "    case \"${words[2]} $option\" in"]
    lines += [f"    {command}\\ {name}) compadd -- {' '.join(words)}; return ;;" for (command, name), words in sorted(found.chosen.items())]
    lines += [f"    {patterns(found.files, found.values)}) _files; return ;;", f"    {patterns(found.values, found.files)}) _message value; return ;;", "    esac",
              f"    if [[ ${{words[2]}} == help ]]; then compadd -- {' '.join(found.helped)}; return; fi",
              "    if [[ $PREFIX != -* ]]; then _files; return; fi", "    case ${words[2]} in"]
    for command, options in found.options.items():
        lines += [f"    {command})", "        found=(", *(f"            {word}" for word in _described(options)), "        )", "        ;;"]
    lines += ["    esac", "    _describe -o option found", "}", "_patina \"$@\""]
    return "\n".join(lines) + "\n"
