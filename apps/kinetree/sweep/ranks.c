/* Sweeps over the processes of MPI.
 *
 * A worker sends the results of a block of runs, which also requests the next block. Rank 0 answers with its first
 * run and the run after its last. An answer of -1 ends the worker, and its second number states whether a rank is
 * lost. A block takes two messages. A block has about a quarter of a second of work, and less towards the end
 * (guided self-scheduling; Polychronopoulos, Kuck 1987). Lines are written in the order of the runs, so that the
 * number of blocks that wait to be written is bounded.
 *
 * A block that takes far longer than any before is also given to an idle rank (backup tasks; Dean, Ghemawat 2004).
 * This repeats the work of a lost rank. Whichever comes first is taken, because the bytes are equal. If no rank is
 * left, rank 0 computes. By default, MPI ends all ranks with the first lost one, and --resume continues the sweep. An
 * option changes this (mpirun --enable-recovery of Open MPI). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "sweep/ranks.h"
#include "subcommands/run.h"

#include <mpi.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { TAG_RESULT = 1, TAG_BLOCK = 2, AHEAD = 8 /* blocks a rank that may wait to be written */ };
static const double block_seconds = 0.25, patience = 2.0; /* s, of work in a block; before it is handed out again */

/* ---- messages ---------------------------------------------------------------------------------------------------- */

/* Head of a worker's message: a block, and its time. The runs follow. */
typedef struct block_head {
    int64_t first, end; /* first < 0: a worker begins */
    double seconds;
    int64_t anew;   /* as kt_sweep_worker.anew */
    int64_t failed; /* memory ran out */
    char why[KT_WHERE_SIZE];
} block_head;

/* Head of a run, behind which its line and its records are. */
typedef struct run_head {
    int64_t code, length, rows;
} run_head;

typedef struct message {
    kt_bytes bytes;
    size_t width; /* numbers of a record */
} message;

static int pack(void *user, int64_t run, const kt_sweep_result *result) {
    message *m = user;
    const run_head head = {result->code, (int64_t)strlen(result->line), (int64_t)result->rows};
    (void)run;
    kt_bytes_add(&m->bytes, &head, sizeof head);
    kt_bytes_add(&m->bytes, result->line, (size_t)head.length + 1);
    kt_bytes_add(&m->bytes, result->records, result->rows * m->width * sizeof(double));
    return m->bytes.is_short ? -1 : 0;
}

/* Hands the runs of a message to the sink. */
static int unpack(const message *m, kt_sweep_sink *sink, void *user) {
    block_head block;
    int failed = 0;
    memcpy(&block, m->bytes.text, sizeof block);
    const char *at = m->bytes.text + sizeof block;
    for (int64_t run = block.first; run < block.end && failed == 0; run++) {
        run_head head;
        memcpy(&head, at, sizeof head);
        at += sizeof head;
        const size_t size = (size_t)head.rows * m->width * sizeof(double);
        kt_sweep_result result = {.code = (int)head.code, .rows = (size_t)head.rows, .line = strdup(at)};
        at += (size_t)head.length + 1;
        result.records = size > 0 ? malloc(size) : NULL;
        if (result.records != NULL)
            memcpy(result.records, at, size);
        at += size;
        failed = result.line == NULL || (size > 0 && result.records == NULL) ? -1 : sink(user, run, &result);
        kt_sweep_result_free(&result);
    }
    return failed;
}

/* Computes a block into a message. */
static void compute_run_block(const kt_sweep *sweep, int64_t first, int64_t end, int threads, message *m) {
    kt_sweep_worker all = {.has_scene = false};
    block_head head = {.first = first, .end = end};
    m->bytes.used = 0;
    m->width = sweep->column_count + 1;
    kt_bytes_add(&m->bytes, &head, sizeof head);
    head.failed = m->bytes.is_short;
    const double start = kt_clock();
    if (!head.failed)
        head.failed = kt_sweep_run_all(sweep, first, end, threads, pack, m, &all) != 0;
    head.seconds = kt_clock() - start;
    head.anew = all.anew;
    memcpy(head.why, all.why, sizeof head.why);
    if (m->bytes.text != NULL)
        memcpy(m->bytes.text, &head, sizeof head);
}

/* ---- the processes ----------------------------------------------------------------------------------------------- */

struct kt_ranks {
    int own, count;
    bool *is_idle; /* rank 0, of each: it has sent what it had, and waits for a block */
    int *idle;     /* those in the order in which they came, the last first */
    int idle_count;
    bool is_done; /* others: there are no more blocks */
    bool is_lost; /* a rank does not answer */
};

/* mpirun of Open MPI, of MPICH, and other starters by PMIx. */
static bool is_started_by_mpi(void) {
    return getenv("OMPI_COMM_WORLD_SIZE") != NULL || getenv("PMI_SIZE") != NULL || getenv("PMIX_RANK") != NULL;
}

bool kt_ranks_is_later(void) {
    return kt_ranks_is_above_zero(getenv("OMPI_COMM_WORLD_SIZE"), getenv("OMPI_COMM_WORLD_RANK")) ||
           kt_ranks_is_above_zero(getenv("PMI_SIZE"), getenv("PMI_RANK"));
}

static void free_ranks(kt_ranks *ranks) {
    free(ranks->is_idle);
    free(ranks->idle);
    free(ranks);
}

kt_ranks *kt_ranks_start(int *code) {
    *code = -1;
    if (!is_started_by_mpi() || MPI_Init(NULL, NULL) != MPI_SUCCESS)
        return NULL;
    kt_ranks *ranks = calloc(1, sizeof *ranks);
    if (ranks != NULL) {
        (void)MPI_Comm_set_errhandler(MPI_COMM_WORLD, MPI_ERRORS_RETURN); /* a rank may be lost */
        (void)MPI_Comm_rank(MPI_COMM_WORLD, &ranks->own);
        (void)MPI_Comm_size(MPI_COMM_WORLD, &ranks->count);
        ranks->is_idle = calloc((size_t)ranks->count, sizeof *ranks->is_idle);
        ranks->idle = calloc((size_t)ranks->count, sizeof *ranks->idle);
    }
    if (ranks == NULL || ranks->is_idle == NULL || ranks->idle == NULL) {
        kt_say("sweep: there is not enough memory");
        (void)MPI_Abort(MPI_COMM_WORLD, KT_EXIT_INTEGRATION);
        return NULL;
    }
    if (ranks->count == 1) {
        free_ranks(ranks);
        (void)MPI_Finalize();
        return NULL;
    }
    if (ranks->own > 0 && freopen("/dev/null", "w", stderr) == NULL) /* of starters whose variables are not known */
        *code = KT_EXIT_INTEGRATION;
    return ranks;
}

int kt_ranks_own(const kt_ranks *ranks) { return ranks != NULL ? ranks->own : 0; }

/* Sends the results of a block, and receives the next block. */
static void exchange_block(kt_ranks *ranks, const void *bytes, size_t size, int64_t block[2]) {
    (void)MPI_Send(bytes, (int)size, MPI_BYTE, 0, TAG_RESULT, MPI_COMM_WORLD);
    (void)MPI_Recv(block, 2, MPI_INT64_T, 0, TAG_BLOCK, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
    ranks->is_done = block[0] < 0;
    ranks->is_lost = ranks->is_done && block[1] != 0;
}

void kt_ranks_work(kt_ranks *ranks, const kt_sweep *sweep, int threads) {
    const block_head begins = {.first = -1};
    message m = {.width = 0};
    int64_t block[2];
    exchange_block(ranks, &begins, sizeof begins, block);
    while (block[0] >= 0) {
        compute_run_block(sweep, block[0], block[1], threads, &m);
        if (m.bytes.text == NULL)
            (void)MPI_Abort(MPI_COMM_WORLD, KT_EXIT_INTEGRATION);
        exchange_block(ranks, m.bytes.text, m.bytes.used, block);
    }
    free(m.bytes.text);
}

/* ---- rank 0 ------------------------------------------------------------------------------------------------------ */

typedef struct block {
    int64_t first, end;
    double since;   /* when it was handed out last */
    message result; /* no bytes: not there yet */
} block;

typedef struct server {
    kt_ranks *ranks;
    const kt_sweep *sweep;
    block *blocks; /* a ring: those that are handed out and not written yet */
    size_t head, count, room;
    int64_t next, end;
    double slowest, cost, bytes; /* s, of a block; s and bytes, of a run */
    int64_t again;               /* blocks that were handed out once more */
    double sought;               /* when slow blocks were looked for */
    kt_sweep_worker *all;
} server;

static block *block_at(const server *s, size_t k) { return &s->blocks[(s->head + k) % s->room]; }

/* A quarter of a second of work, a message of 64 MB at most, and at the end a part of the remaining runs. */
static int64_t choose_size(const server *s) {
    const int64_t left = s->end - s->next, share = left / (4 * (int64_t)s->ranks->count) + 1;
    double most = s->cost > 0.0 ? block_seconds / s->cost : 1.0;
    most = s->bytes > 0.0 && most > 64e6 / s->bytes ? 64e6 / s->bytes : most;
    const int64_t size = most > 4096.0 ? 4096 : most < 1.0 ? 1 : (int64_t)most;
    return size < share ? size : share;
}

/* The next block; else the oldest that takes too long; NULL: there is none. */
static block *choose_block(server *s, double now) {
    if (s->next < s->end && s->count < s->room) {
        block *b = block_at(s, s->count++);
        *b = (block){.first = s->next};
        s->next += choose_size(s);
        b->end = s->next;
        return b;
    }
    if (now - s->sought < 0.05 * patience)
        return NULL;
    s->sought = now;
    for (size_t k = 0; k < s->count; k++) {
        block *b = block_at(s, k);
        if (b->result.bytes.text == NULL && now - b->since > patience + 4.0 * s->slowest) {
            s->again++;
            return b;
        }
    }
    return NULL;
}

static void hand_out_blocks(server *s, double now) {
    kt_ranks *ranks = s->ranks;
    while (ranks->idle_count > 0) {
        block *b = choose_block(s, now);
        if (b == NULL)
            return;
        const int rank = ranks->idle[--ranks->idle_count];
        const int64_t runs[2] = {b->first, b->end};
        b->since = now;
        ranks->is_idle[rank] = false;
        (void)MPI_Send(runs, 2, MPI_INT64_T, rank, TAG_BLOCK, MPI_COMM_WORLD);
    }
}

/* The block that begins with this run; NULL: it has been written. */
static block *find_open_block(const server *s, int64_t first) {
    size_t low = 0, high = s->count;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        if (block_at(s, middle)->first < first)
            low = middle + 1;
        else
            high = middle;
    }
    return low < s->count && block_at(s, low)->first == first ? block_at(s, low) : NULL;
}

/* Takes the results of a block, unless they are there already. */
static int take_block(server *s, message *m) {
    block_head head;
    memcpy(&head, m->bytes.text, sizeof head);
    if (head.failed)
        return -1;
    block *b = head.first >= 0 ? find_open_block(s, head.first) : NULL;
    if (b == NULL || b->result.bytes.text != NULL)
        return 0;
    const double runs = (double)(head.end - head.first);
    b->result = *m;
    *m = (message){.width = 0};
    s->slowest = head.seconds > s->slowest ? head.seconds : s->slowest;
    s->cost = head.seconds / runs;
    s->bytes = (double)b->result.bytes.used / runs;
    s->all->runs += head.end - head.first;
    s->all->anew += head.anew;
    if (s->all->why[0] == '\0')
        memcpy(s->all->why, head.why, sizeof s->all->why);
    return 0;
}

/* Receives a message and returns 1. Returns 0 without a message, and -1 if a worker or memory has failed. */
static int receive_block(server *s) {
    MPI_Status status;
    int there = 0, size = 0;
    if (MPI_Iprobe(MPI_ANY_SOURCE, TAG_RESULT, MPI_COMM_WORLD, &there, &status) != MPI_SUCCESS || !there)
        return 0;
    (void)MPI_Get_count(&status, MPI_BYTE, &size);
    message m = {.width = s->sweep->column_count + 1};
    if (kt_bytes_room(&m.bytes, (size_t)size) == NULL)
        return -1;
    m.bytes.used = (size_t)size;
    (void)MPI_Recv(m.bytes.text, size, MPI_BYTE, status.MPI_SOURCE, TAG_RESULT, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
    s->ranks->is_idle[status.MPI_SOURCE] = true;
    s->ranks->idle[s->ranks->idle_count++] = status.MPI_SOURCE;
    const int failed = take_block(s, &m);
    free(m.bytes.text);
    return failed != 0 ? -1 : 1;
}

/* Writes the blocks that are there, from the first on. */
static int write_blocks(server *s, kt_sweep_sink *sink, void *user) {
    int failed = 0;
    while (failed == 0 && s->count > 0 && block_at(s, 0)->result.bytes.text != NULL) {
        block *b = block_at(s, 0);
        failed = unpack(&b->result, sink, user);
        free(b->result.bytes.text);
        b->result = (message){.width = 0};
        s->head = (s->head + 1) % s->room;
        s->count--;
    }
    return failed;
}

/* If no rank has answered for long, rank 0 computes the block that all wait for. */
static int compute_own(server *s) {
    const block *b = block_at(s, 0);
    message m = {.width = 0};
    if (s->count == 0 || b->result.bytes.text != NULL)
        return 0;
    compute_run_block(s->sweep, b->first, b->end, 1, &m);
    const int failed = m.bytes.text == NULL ? -1 : take_block(s, &m);
    free(m.bytes.text);
    s->again++;
    return failed;
}

static int serve(server *s, kt_sweep_sink *sink, void *user) {
    double heard = kt_clock();
    while (s->next < s->end || s->count > 0) {
        const int got = receive_block(s);
        const double now = kt_clock();
        if (got > 0)
            heard = now;
        else
            (void)nanosleep(&(struct timespec){.tv_nsec = 200000}, NULL);
        const bool is_alone = now - heard > 10.0 * patience + 20.0 * s->slowest;
        hand_out_blocks(s, now);
        if (got < 0 || (is_alone && compute_own(s) != 0) || write_blocks(s, sink, user) != 0)
            return -1;
    }
    return 0;
}

int kt_ranks_serve(kt_ranks *ranks, const kt_sweep *sweep, int64_t first, int64_t end, kt_sweep_sink *sink, void *user,
                   kt_sweep_worker *all) {
    const size_t room = (size_t)AHEAD * (size_t)ranks->count;
    server s = {.ranks = ranks, .sweep = sweep, .room = room, .next = first, .end = end, .all = all};
    s.blocks = calloc(room, sizeof *s.blocks);
    const int failed = s.blocks != NULL ? serve(&s, sink, user) : -1;
    if (failed != 0 && s.blocks == NULL)
        kt_say("sweep: there is not enough memory");
    if (s.again > 0)
        kt_say("sweep: %lld block%s of runs took a rank too long, or it is lost, and %s done again", (long long)s.again,
               s.again == 1 ? "" : "s", s.again == 1 ? "was" : "were");
    for (size_t k = 0; s.blocks != NULL && k < room; k++)
        free(s.blocks[k].result.bytes.text);
    free(s.blocks);
    return failed;
}

/* Waits some seconds for those that still compute; whether all have answered. */
static bool gather_answers(kt_ranks *ranks) {
    const kt_sweep nothing = {.column_count = 0};
    kt_sweep_worker all = {.has_scene = false};
    server s = {.ranks = ranks, .sweep = &nothing, .all = &all};
    const double start = kt_clock();
    for (;;) {
        int there = 1;
        for (int rank = 1; rank < ranks->count; rank++)
            there += ranks->is_idle[rank];
        if (there == ranks->count || kt_clock() - start > 5.0 * patience)
            return there == ranks->count;
        if (receive_block(&s) == 0)
            (void)nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
    }
}

/* MPI_Finalize waits for all ranks: where one is lost, each ends by itself. */
static void let_go(kt_ranks *ranks) {
    ranks->is_lost = !gather_answers(ranks);
    const int64_t none[2] = {-1, ranks->is_lost};
    for (int rank = 1; rank < ranks->count; rank++)
        if (ranks->is_idle[rank])
            (void)MPI_Send(none, 2, MPI_INT64_T, rank, TAG_BLOCK, MPI_COMM_WORLD);
    if (ranks->is_lost)
        kt_say("sweep: a rank was lost");
}

int kt_ranks_end(kt_ranks *ranks, int code) {
    const block_head begins = {.first = -1};
    int64_t none[2];
    if (ranks == NULL)
        return code;
    if (ranks->own == 0)
        let_go(ranks);
    else if (!ranks->is_done) /* rank 0 reports a wrong scene */
        exchange_block(ranks, &begins, sizeof begins, none);
    if (ranks->is_lost) {
        (void)fflush(NULL);
        _exit(code);
    }
    free_ranks(ranks);
    (void)MPI_Finalize();
    return code;
}
