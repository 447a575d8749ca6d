# weft: make, make demo, make test. `make help` lists the rest.

B       = build
MODE    = release
CC      = gcc
JOBS    = $(shell nproc)
PROVE   = prove -j$(JOBS)

# Where `make install` puts things; SYSCONFDIR: what people change; UNITDIR: units of systemd.
DESTDIR =
PREFIX  = /usr/local
SYSCONFDIR = $(if $(filter /usr /usr/local,$(PREFIX)),,$(PREFIX))/etc
UNITDIR = $(PREFIX)/lib/systemd/system

VERSION = 0.1.0

# As many jobs as there are cores, unless the command line says how many; but nothing is built while it is removed.
ifeq ($(MAKELEVEL)$(filter clean,$(MAKECMDGOALS)),0)
MAKEFLAGS += -j$(JOBS)
endif

# What the bytes of a picture rest on. No contraction into fused operations, so that every CPU rounds
# alike; no SLP vectoriser, because gcc 12 loses conversions to float with it; the two -fno- flags on the
# right change no value, they only free the compiler from errno and trap flags that nobody reads.
NUMERIC = -ffp-contract=off -fno-tree-slp-vectorize -fno-math-errno -fno-trapping-math
WARN    = -Wall -Wextra -Wshadow -Wstrict-prototypes -Wmissing-prototypes -Wpointer-arith -Werror
CPPFLAGS = -D_GNU_SOURCE -Icommon -I. -I$(B) -DWEFT_VERSION='"$(VERSION)"'
CFLAGS_release  = -O3 -g
CFLAGS_sanitize = -O1 -g -fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer
# clang, unlike gcc, complains of an empty list's NULL + 0 as well, which all compilers take for NULL.
CFLAGS_fuzz     = $(CFLAGS_sanitize) -fsanitize=fuzzer-no-link -fno-sanitize=pointer-overflow
CFLAGS  = -std=c11 $(CFLAGS_$(MODE)) $(WARN) $(NUMERIC) -pthread
LDFLAGS_sanitize = -fsanitize=address,undefined
LDFLAGS_fuzz     = -fsanitize=fuzzer,address,undefined
LDFLAGS = $(LDFLAGS_$(MODE)) -pthread
LDLIBS  = -lzmq -lcjson -lpng -lsodium -lmicrohttpd -lm
TEST_LIBS = -lcmocka -lmpfr -lgmp -lquadmath
Q       = $(if $(V),,@) # make V=1 shows the commands

COMMON  = $(wildcard common/*/*.c)

# Files that are compiled once for each instruction set of the machine (common/trace/lanes.h). FMA stays unused.
LANES   = $(wildcard common/trace/lanes/*.c)
ISAS_x86_64  = sse2 avx2 avx512
ISAS_aarch64 = neon
# Without optimisation for speed, gcc takes the odd constant from the x87 unit, which rounds otherwise.
NO_X87       = $(if $(filter x86_64%,$(TARGET)),-mno-80387)
FLAGS_avx2   = -mavx2
FLAGS_avx512 = -mavx512f -mavx512vl -mavx512dq -mavx512bw -mprefer-vector-width=512
# The compiler's target; where no compiler is installed yet, the machine itself.
TARGET := $(or $(shell $(CC) -dumpmachine 2>/dev/null),$(shell uname -m))
ISAS   := $(ISAS_$(firstword $(subst -, ,$(TARGET))))
# clang warns of loops that it leaves scalar (those that gather); gcc does not know the option and does not mind.
LANE_WARN    = -Wno-pass-failed
# The scalar kernel has calls of its own for what goes through the tree; the others it has without vectors.
FLAGS_ref    = -fno-tree-vectorize
LANES_ref    = $(filter-out %/closest.c %/shadow.c,$(LANES))
LANE_OBJECTS = $(foreach isa,$(ISAS),$(LANES:%.c=$(B)/obj/%.$(isa).o)) $(LANES_ref:%.c=$(B)/obj/%.ref.o)

FARM    = $(filter-out %/main.c,$(wildcard coordinator/*.c worker/*.c))
OBJECTS = $(patsubst %.c,$(B)/obj/%.o,$(COMMON) $(FARM) $(wildcard coordinator/main.c worker/main.c))
PROGRAMS = $(if $(wildcard coordinator/main.c),$(B)/weft) $(if $(wildcard worker/main.c),$(B)/weft-worker)

FUZZ_TARGETS = $(patsubst tests/fuzz/%.c,%,$(filter-out %/replay.c,$(wildcard tests/fuzz/*.c)))
C_TESTS = $(patsubst tests/%.c,$(B)/tests/%.t,$(wildcard tests/unit/*.c tests/numeric/*.c tests/kernel/*.c tests/sim/*.c tests/golden/*.c tests/isa/*.c)) $(FUZZ_TARGETS:%=$(B)/tests/fuzz/%.t)
SHELL_TESTS = $(wildcard tests/build/*.t tests/farm/*.t tests/fault/*.t tests/golden/*.t tests/manuals/*.t \
                         tests/web/*.t tests/bench/*/*.t) tests/deploy/install.t tests/deploy/units.t
FAIL    = $(B)/tests/fault/fail.so
LIAR    = $(B)/tests/farm/liar

.PHONY: all install uninstall deb demo pictures test test-one-mode test-isa test-deploy chaos failures fuzz fuzz-targets \
        soak bench bench-scale bench-peers bench-error clean help
.SECONDARY:
.DELETE_ON_ERROR:
all: $(PROGRAMS)

help:
	@echo 'make            builds $(B)/weft and $(B)/weft-worker (installing what is missing, by apt)'
	@echo 'make install    puts programs, manuals and examples into PREFIX=$(PREFIX); DESTDIR=ROOT: of another root'
	@echo 'make uninstall  takes them away again'
	@echo 'make deb        $(B)/deb/weft_$(VERSION)_….deb, a package for Debian and its kin'
	@echo 'make demo       renders scenes/showcase.json with two workers into showcase.png'
	@echo 'make test       all tests, in release mode and with address and undefined-behaviour sanitizers'
	@echo 'make test-isa   the same bits from other compilers, options and CPUs (installing emulators, by apt)'
	@echo 'make test-deploy'
	@echo '                packages, services, ssh and clusters, tried on this machine (as root; installing them, by apt)'
	@echo 'make fuzz       readers of files and messages under libFuzzer, S=60 seconds each (with clang); T=TARGET: one'
	@echo 'make soak SEEDS=100000'
	@echo '                so many histories of each simulation (FIRST_SEED=7: from that one on); what fails names its seed'
	@echo 'make chaos      renders while links, workers and coordinators fail at random, for S=600 seconds (as root)'
	@echo 'make failures   every operation that can fail does, allocations too: minutes'
	@echo 'make bench      kernels, trees, whole renders, the cost of the farm: figures on stdout'
	@echo 'make bench-scale'
	@echo '                thousands of workers, pictures of gigabytes: figures on stdout (ten minutes)'
	@echo 'make bench-peers'
	@echo '                CPU time against POV-Ray and Tachyon (installing them, by apt); FULL=1: at full size;'
	@echo '                NFF=FOLDER: other copies of the .nff scenes; PEERS=--help: other options of the script'
	@echo 'make bench-error'
	@echo '                error against CPU time of weft, POV-Ray and Tachyon, with plots (an hour and a half;'
	@echo '                installing gnuplot too); FULL=1, NFF=FOLDER: as above; ERROR=--help: other options'
	@echo 'make pictures   renders the pictures of scenes/README.md anew, into scenes/pictures'
	@echo 'make clean      removes what was built'
	@echo 'CC=clang builds with clang; MODE=sanitize B=build/sanitize builds with sanitizers'

# --- installing ---------------------------------------------------------------------------------------
install: all
install uninstall:
	@B='$(B)' VERSION='$(VERSION)' DESTDIR='$(DESTDIR)' PREFIX='$(PREFIX)' SYSCONFDIR='$(SYSCONFDIR)' \
	    UNITDIR='$(UNITDIR)' deploy/install-files $@

# By Debian's own tools, from a copy of the sources.
deb: $(B)/dependencies
	deploy/install-dependencies --deb
	CC='$(CC)' deploy/debian/build '$(B)/deb' '$(VERSION)'

# Those of scenes/README.md, which tests/manuals/pictures.t holds weft to.
pictures: all
	scenes/pictures/render $(B)/weft scenes/pictures

demo: all
	$(B)/weft render scenes/showcase.json --workers 2 -o showcase.png

# --- dependencies -------------------------------------------------------------------------------------
# The stamp is made anew for each build folder; the script does nothing where everything is there.
$(B)/dependencies: deploy/install-dependencies
	@mkdir -p $(@D)
	deploy/install-dependencies
	@touch $@

# --- the tracing core's revision ------------------------------------------------------------------------
# A digest of the sources that decide a pixel; workers and coordinator compare it at joining.
CORE_SOURCES = $(sort $(wildcard common/base/*.[ch] common/math/*.[ch] common/image/*.[ch] common/scene/*.[ch] common/trace/*.[ch] common/trace/lanes/*.[ch]))
$(B)/core_revision.h: $(CORE_SOURCES) Makefile
	@mkdir -p $(@D)
	@printf '#define CORE_REVISION "%s"\n' "$$(cat $(CORE_SOURCES) | sha256sum | cut -c1-64)" >$@

# --- compiling -------------------------------------------------------------------------------------------
$(B)/obj/%.o: %.c $(B)/core_revision.h Makefile | $(B)/dependencies
	@mkdir -p $(@D)
	$(if $(V),,@echo '  CC   $<')
	$(Q)$(CC) $(CPPFLAGS) $(CFLAGS) $(if $(filter common/%,$<),$(NO_X87)) -MMD -MP -c -o $@ $<

# The files of the status page, as arrays of bytes that page.c includes.
PAGE = $(wildcard coordinator/page/*)
$(B)/page_data.h: $(PAGE) Makefile
	@mkdir -p $(@D)
	@for file in $(PAGE); do \
	    echo "static const unsigned char page_$$(basename $$file | tr . _)[] = {"; \
	    od -v -An -tu1 $$file | sed -E 's/([0-9]+)/\1,/g'; echo '};'; done >$@
$(B)/obj/coordinator/page.o: $(B)/page_data.h

define LANES_RULE
$(B)/obj/common/trace/lanes/%.$(1).o: common/trace/lanes/%.c $(B)/core_revision.h Makefile | $(B)/dependencies
	@mkdir -p $$(@D)
	$(if $(V),,@echo '  CC   $$< ($(1))')
	$(Q)$(CC) $(CPPFLAGS) $(CFLAGS) $(LANE_WARN) -DLANES_SUFFIX=$(1) $(FLAGS_$(1)) $(NO_X87) -MMD -MP -c -o $$@ $$<
endef
$(foreach isa,ref $(ISAS),$(eval $(call LANES_RULE,$(isa))))

$(B)/libweft.a: $(patsubst %.c,$(B)/obj/%.o,$(COMMON) $(FARM)) $(LANE_OBJECTS)
	@rm -f $@
	$(Q)$(AR) rcs $@ $^

$(B)/weft: $(B)/obj/coordinator/main.o $(B)/libweft.a
	$(if $(V),,@echo '  LINK $@')
	$(Q)$(CC) $(LDFLAGS) -o $@ $^ $(LDLIBS)

$(B)/weft-worker: $(B)/obj/worker/main.o $(B)/libweft.a
	$(if $(V),,@echo '  LINK $@')
	$(Q)$(CC) $(LDFLAGS) -o $@ $^ $(LDLIBS)

$(B)/tests/%.t: $(B)/obj/tests/%.o $(B)/libweft.a
	@mkdir -p $(@D)
	$(if $(V),,@echo '  LINK $@')
	$(Q)$(CC) $(LDFLAGS) -o $@ $^ $(TEST_LIBS) $(LDLIBS)

# The corpus of a fuzz target, put through it without a fuzzer.
$(B)/tests/fuzz/%.t: $(B)/obj/tests/fuzz/%.o $(B)/obj/tests/fuzz/replay.o $(B)/libweft.a
	@mkdir -p $(@D)
	$(if $(V),,@echo '  LINK $@')
	$(Q)$(CC) $(LDFLAGS) -o $@ $^ $(LDLIBS)

-include $(OBJECTS:.o=.d) $(LANE_OBJECTS:.o=.d) $(patsubst $(B)/tests/%.t,$(B)/obj/tests/%.d,$(C_TESTS)) \
         $(B)/obj/tests/fuzz/replay.d

# --- tests -------------------------------------------------------------------------------------------------
# Both modes, one prove run each. WEFT_BUILD tells the shell tests which programs to run.
test:
	$(MAKE) MODE=release B=$(B) test-one-mode
	$(MAKE) MODE=sanitize B=$(B)/sanitize test-one-mode

test-one-mode: all $(C_TESTS) $(FAIL) $(LIAR)
	CMOCKA_MESSAGE_OUTPUT=TAP WEFT_BUILD=$(B) WEFT_MODE=$(MODE) $(PROVE) --timer -e '' $(TESTS) $(if $(TESTS),,$(C_TESTS) $(SHELL_TESTS))

# A worker that flips a bit now and then.
$(LIAR): $(B)/obj/worker/main.o $(B)/obj/tests/farm/liar.o $(B)/libweft.a
	@mkdir -p $(@D)
	$(if $(V),,@echo '  LINK $@')
	$(Q)$(CC) $(LDFLAGS) -Wl,--wrap=band_complete -o $@ $^ $(LDLIBS)

# Loaded into the programs to make their operations fail; so it has no sanitizers itself.
$(FAIL): tests/fault/fail.c | $(B)/dependencies
	@mkdir -p $(@D)
	$(if $(V),,@echo '  CC   $<')
	$(Q)$(CC) -D_GNU_SOURCE -std=c11 -O2 -g $(WARN) -fPIC -shared -o $@ $<

# For S seconds; SEED=N makes the choices of an earlier run again.
chaos: S = 600
chaos: all
	WEFT_BUILD=$(B) WEFT_MODE=$(MODE) tests/fault/chaos $(S) $(SEED)

# What make test tries some of.
failures: all $(FAIL)
	WEFT_BUILD=$(B) WEFT_MODE=$(MODE) FULL=1 $(PROVE) --timer -e '' tests/fault/fail-*.t

# What cannot be installed here is skipped there.
test-isa: $(B)/tests/isa/signature.t
	-deploy/install-dependencies --isa $(B)/arm64
	WEFT_BUILD=$(B) $(PROVE) --timer --verbose -e '' tests/isa/*.t

# All of tests/deploy; `make test` has those that take seconds. What cannot be installed here is skipped there.
test-deploy: all
	-deploy/install-dependencies --deploy
	-deploy/install-dependencies --cluster
	-deploy/install-dependencies --isa $(B)/arm64
	-deploy/install-dependencies --kubernetes $(B)/kubernetes
	WEFT_BUILD=$(B) WEFT_MODE=$(MODE) CC='$(CC)' prove --timer --verbose -e '' tests/deploy/*.t

# --- soaking -------------------------------------------------------------------------------------------------
# `build/tests/sim/farm.t SEED` replays one.
SOAK  = $(patsubst tests/%.c,$(B)/tests/%.t,$(wildcard tests/sim/*.c))
SEEDS = 20000
soak: $(SOAK)
	CMOCKA_MESSAGE_OUTPUT=TAP SEEDS=$(SEEDS) $(PROVE) --timer --verbose -e '' $(SOAK)

# --- fuzzing -------------------------------------------------------------------------------------------------
# Each target in turn for S seconds on a copy of its corpus, in $(B)/fuzz, where findings stay too (tests/fuzz/run).
CLANG = clang
S     = 60
T     = $(FUZZ_TARGETS)

fuzz:
	@tests/fuzz/run --check $(CLANG)
	$(MAKE) CC=$(CLANG) MODE=fuzz B=$(B)/fuzz T='$(T)' fuzz-targets
	@tests/fuzz/run $(B)/fuzz $(S) $(T)

fuzz-targets: $(T:%=$(B)/targets/%)

$(B)/targets/%: $(B)/obj/tests/fuzz/%.o $(B)/libweft.a
	@mkdir -p $(@D)
	$(if $(V),,@echo '  LINK $@')
	$(Q)$(CC) $(LDFLAGS) -o $@ $^ $(LDLIBS)

# --- benchmarks ----------------------------------------------------------------------------------------------
BENCHES = $(patsubst tests/bench/%.c,$(B)/bench/%,$(wildcard tests/bench/*.c))
EXPORT  = $(patsubst %.c,$(B)/obj/%.o,$(wildcard tests/bench/peers/*.c))

$(B)/bench/export: $(EXPORT) $(B)/libweft.a
	@mkdir -p $(@D)
	$(if $(V),,@echo '  LINK $@')
	$(Q)$(CC) $(LDFLAGS) -o $@ $^ $(LDLIBS)

$(B)/bench/%: $(B)/obj/tests/bench/%.o $(B)/libweft.a
	@mkdir -p $(@D)
	$(if $(V),,@echo '  LINK $@')
	$(Q)$(CC) $(LDFLAGS) -o $@ $^ $(LDLIBS)

-include $(EXPORT:.o=.d) $(patsubst $(B)/%,$(B)/obj/tests/%.d,$(BENCHES))

bench: all $(BENCHES)
	$(B)/bench/kernels
	$(B)/bench/tree 1000000
	$(B)/bench/stages 512 scenes/showcase.json $(wildcard tests/bench/scenes/*.nff)
	$(B)/bench/render 320 $(filter-out %.schema.json,$(wildcard scenes/*.json)) $(wildcard tests/bench/scenes/*.nff)
	$(B)/bench/farm $(B)/weft scenes/showcase.json scenes/first.json

bench-scale: all $(BENCHES)
	$(B)/bench/schedule
	$(B)/bench/crowd $(B)/weft scenes/first.json 1000 5000
	$(B)/bench/large $(B)/weft $(B)/weft-worker scenes/first.json 30000

bench-peers: all $(B)/bench/export
	WEFT_BUILD=$(B) CC=$(CC) tests/bench/peers/run $(if $(FULL),--full) $(if $(NFF),--nff '$(NFF)') $(PEERS)

bench-error: all $(B)/bench/export
	WEFT_BUILD=$(B) CC=$(CC) tests/bench/error/run $(if $(FULL),--full) $(if $(NFF),--nff '$(NFF)') $(ERROR)

clean:
	rm -rf $(B)
