/* Reads formulas with recursive descent, a function for each line of the grammar in kinetree/expression.h, into terms
 * in postfix order. A character yields at most one term, except for `a <op>` pairs that wait for their second value. A
 * text of n bytes therefore has at most n terms.
 *
 * A function of the grammar returns false after it has reported a fault. *is_angle: whether the value is an angle. A
 * sum is an angle if any of its terms is, a product of two if exactly one of them is, and a quotient if only the
 * numerator is. Powers, calls and comparisons are plain numbers. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/text.h"
#include "expression/lookup.h"

#include "algebra/angle.h"
#include "base/decimal.h"
#include "base/names.h"

#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#define FUNCTION_NAME(id, name, least, most) {#name, KT_OPERATOR_##id, least, most},
static const struct {
    const char *name;
    kt_operator code;
    int least, most; /* number of arguments */
} functions[] = {KT_EXPRESSION_FUNCTION_LIST(FUNCTION_NAME)};
enum { FUNCTION_COUNT = sizeof functions / sizeof *functions };

static const char constant_pi[] = "pi";

typedef struct kt_parser {
    const char *text, *at; /* the whole, and the next character */
    const kt_symbols *symbols;
    kt_expression *to;
    int height;       /* values on the stack */
    bool condition;   /* the last value is 1 or 0: a comparison, or several */
    int depth;        /* parentheses, signs and exponents within one another */
    const char *spot; /* where the fault is */
    kt_error *error;
} kt_parser;

static bool reject_formula(kt_parser *p, const char *spot, const char *format, ...) KT_PRINTF(3, 4);

/* Reports a fault at `spot`, with its column. Returns false for the caller to return. */
static bool reject_formula(kt_parser *p, const char *spot, const char *format, ...) {
    char text[KT_MESSAGE_SIZE];
    va_list arguments;
    va_start(arguments, format);
    (void)vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    char where[KT_WHERE_SIZE];
    (void)snprintf(where, sizeof where, "column %d", (int)(spot - p->text) + 1);
    (void)kt_error_set(p->error, KT_ERROR_SCENE, where, "%s", text);
    p->spot = spot;
    return false;
}

/* Appends a term. The height follows the stack of an evaluation: a leaf adds a value, and a binary operator replaces
 * two by one. A comparison is a condition; parse_joined sets p->condition after `and` and `or`. */
static bool put_term(kt_parser *p, kt_expression_term term) {
    p->height += kt_operator_is_leaf((kt_operator)term.code)     ? 1
                 : kt_operator_is_binary((kt_operator)term.code) ? -1
                                                                 : 0;
    if (p->height > KT_EXPRESSION_DEPTH_MAX)
        return reject_formula(p, p->at,
                              "more than %d values wait for their operator; compute a part of it as a parameter",
                              KT_EXPRESSION_DEPTH_MAX);
    p->to->term[p->to->count++] = term;
    p->condition = term.code >= KT_OPERATOR_LESS && term.code <= KT_OPERATOR_NOT_EQUAL;
    return true;
}

static bool put_operator(kt_parser *p, kt_operator code) {
    return put_term(p, (kt_expression_term){.code = (int32_t)code});
}

/* The call of table k, whose compiled numbers lie behind those of the tables before it. */
static bool put_lookup(kt_parser *p, int k) {
    const kt_lookup *tables = p->symbols->tables;
    const double *table = p->symbols->compiled;
    kt_expression_term *to = &p->to->term[p->to->count];
    for (int i = 0; i < k && table != NULL; i++)
        table += kt_lookup_size(table);
    const kt_operator code = tables[k].inputs == 2 ? KT_OPERATOR_LOOKUP2 : KT_OPERATOR_LOOKUP;
    if (!put_term(p, (kt_expression_term){.code = (int32_t)code, .symbol = k}))
        return false;
    kt_lookup_attach(to, table);
    return true;
}

/* ---- characters -------------------------------------------------------------------------------------------------- */

static void skip_blanks(kt_parser *p) {
    while (*p->at == ' ' || *p->at == '\t' || *p->at == '\n' || *p->at == '\r')
        p->at++;
}

/* If the next character is this character, skips the character and the blanks after it. */
static bool take_character(kt_parser *p, char c) {
    if (*p->at != c)
        return false;
    p->at++;
    skip_blanks(p);
    return true;
}

/* Whether a word is next. */
static bool is_word(const kt_parser *p, const char *word) {
    const size_t length = strlen(word);
    const char *end = p->at + length;
    return strncmp(p->at, word, length) == 0 && !kt_is_letter(*end) && !kt_is_digit(*end) && *end != '.' && *end != '[';
}

static bool take_word(kt_parser *p, const char *word) {
    if (!is_word(p, word))
        return false;
    p->at += strlen(word);
    skip_blanks(p);
    return true;
}

/* The text at a position, for messages: a word, or a character. */
static const char *found_at(const char *spot, char text[KT_NAME_TEXT_SIZE]) {
    char word[KT_NAME_TEXT_SIZE] = "";
    size_t length = 0;
    if (*spot == '\0')
        return "the end";
    while (length + 1 < sizeof word && (kt_is_letter(spot[length]) || kt_is_digit(spot[length])))
        length++;
    while (length == 0 || ((unsigned char)spot[length] & 0xC0U) == 0x80U) /* a character of UTF-8 is not cut */
        length++;
    memcpy(word, spot, length < sizeof word ? length : sizeof word - 1);
    (void)snprintf(text, KT_NAME_TEXT_SIZE, "%s", kt_name_quote(word).text);
    return text;
}

/* ---- numbers ----------------------------------------------------------------------------------------------------- */

/* A unit after a number. */
static bool parse_unit(kt_parser *p, double *value, bool *is_angle) {
    const char *spot = p->at;
    char text[KT_NAME_TEXT_SIZE];
    if (!kt_is_letter(*spot) || is_word(p, "and") || is_word(p, "or"))
        return true;
    const bool degrees = strncmp(spot, "deg", 3) == 0;
    if ((degrees || strncmp(spot, "rad", 3) == 0) && !kt_is_letter(spot[3]) && !kt_is_digit(spot[3])) {
        *value = degrees ? kt_radians(*value) : *value;
        *is_angle = true;
        p->at += 3;
        skip_blanks(p);
        return true;
    }
    return reject_formula(p, spot, "an operator is missing before %s; write * for a product, and numbers in SI units",
                          found_at(spot, text));
}

static bool parse_number(kt_parser *p, bool *is_angle) {
    const char *const spot = p->at;
    double value = 0.0;
    if (!kt_decimal_read(spot, &value, &p->at))
        return reject_formula(p, spot,
                              kt_decimal_end(spot) > spot ? "this number is too large; the largest is about 1.8e308"
                                                          : "a digit is missing before or after this point");
    skip_blanks(p);
    return parse_unit(p, &value, is_angle) &&
           put_term(p, (kt_expression_term){.code = KT_OPERATOR_NUMBER, .number = value});
}

/* ---- names ------------------------------------------------------------------------------------------------------- */

/* The end of letters, digits, _, inner dots and [k]. */
static const char *skip_name(const char *at) {
    for (;;) {
        if (kt_is_letter(*at) || kt_is_digit(*at) || (*at == '.' && (kt_is_letter(at[1]) || kt_is_digit(at[1])))) {
            at++;
        } else if (*at == '[' && kt_is_digit(at[1])) {
            const char *end = at + 1;
            while (kt_is_digit(*end))
                end++;
            if (*end != ']')
                return at;
            at = end + 1;
        } else {
            return at;
        }
    }
}

/* Copies the text from `from` to `to` into `name` (empty if it is too long). Returns whether it is a symbol. */
static bool find_formula_name(const kt_parser *p, const char *from, const char *to,
                              char name[KT_EXPRESSION_NAME_MAX + 1], kt_symbol *symbol) {
    const size_t length = (size_t)(to - from);
    *name = '\0';
    if (length > KT_EXPRESSION_NAME_MAX)
        return false;
    memcpy(name, from, length);
    name[length] = '\0';
    return p->symbols != NULL && p->symbols->find != NULL && p->symbols->find(p->symbols->user, name, symbol);
}

/* Whether a name is in "a, b, c". */
static bool lists_name(const char *list, const char *name) {
    const size_t length = strlen(name);
    for (const char *at = list; *at != '\0'; at += strspn(at, ", ")) {
        const size_t one = strcspn(at, ",");
        if (one == length && strncmp(at, name, length) == 0)
            return true;
        at += one;
    }
    return false;
}

/* Reports a name that is unknown and resembles none, with the first existing names. A name may have two meanings,
 * such as a parameter and the auxiliary state of an event that sets it. */
static bool reject_with_list(kt_parser *p, const char *spot, const char *name) {
    enum { SHOWN = 6 };
    char list[KT_MESSAGE_SIZE / 2] = "";
    const char *known;
    size_t used = 0;
    int shown = 0;
    for (int k = 0; shown <= SHOWN && used < sizeof list && (known = p->symbols->list(p->symbols->user, k)) != NULL;
         k++) {
        if (lists_name(list, known))
            continue;
        used += (size_t)snprintf(list + used, sizeof list - used, "%s%.40s", shown > 0 ? ", " : "",
                                 shown < SHOWN ? known : "...");
        shown++;
    }
    return reject_formula(p, spot, "there is no name %s; names are %s", kt_name_quote(name).text, list);
}

/* Tries all symbols. The list may write each name to the same memory, so that the number identifies the symbol. */
static void try_symbols(const kt_parser *p, kt_nearest *nearest) {
    int best = -1;
    for (int k = 0;; k++) {
        const char *candidate = p->symbols->list(p->symbols->user, k);
        if (candidate == NULL)
            break;
        nearest->best = NULL;
        (void)kt_nearest_try(nearest, candidate);
        best = nearest->best != NULL ? k : best;
    }
    nearest->best = best >= 0 ? p->symbols->list(p->symbols->user, best) : NULL;
}

/* Reports a quantity that follows from all forces, if no known name is of this kind. A force that read this quantity
 * would depend on itself. Returns false if there was nothing to report. */
static bool reject_response(kt_parser *p, const char *spot, const char *name) {
    static const char *const kinds[] = {"reaction.", "acceleration.", "bearing."};
    const char *known;
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
        const size_t length = strlen(kinds[i]);
        bool exists = strncmp(name, kinds[i], length) != 0 || p->symbols == NULL || p->symbols->list == NULL;
        for (int k = 0; !exists && (known = p->symbols->list(p->symbols->user, k)) != NULL; k++)
            exists = strncmp(known, kinds[i], length) == 0;
        if (!exists) {
            (void)reject_formula(p, spot,
                                 "there is no name %s: %.*ss follow from all forces, so that formulas of forces and "
                                 "loops cannot read them. They exist in events (`when`) and columns only",
                                 kt_name_quote(name).text, (int)length - 1, kinds[i]);
            return true;
        }
    }
    return false;
}

/* Reports an undefined name, or function or table (is_function), with the nearest defined one. */
static bool reject_undefined(kt_parser *p, const char *spot, const char *name, bool is_function) {
    kt_nearest nearest = kt_nearest_make(name, NULL);
    if (strlen(name) == 0)
        return reject_formula(p, spot, "a name has more than %d characters", KT_EXPRESSION_NAME_MAX);
    if (!is_function && reject_response(p, spot, name))
        return false;
    if (!is_function && p->symbols != NULL && p->symbols->list != NULL)
        try_symbols(p, &nearest);
    if (!is_function)
        (void)kt_nearest_try(&nearest, constant_pi);
    for (int k = 0; is_function && k < FUNCTION_COUNT; k++)
        (void)kt_nearest_try(&nearest, functions[k].name);
    for (int k = 0; is_function && p->symbols != NULL && k < p->symbols->table_count; k++)
        if (p->symbols->tables[k].name != NULL)
            (void)kt_nearest_try(&nearest, p->symbols->tables[k].name);
    if (!is_function && nearest.best == NULL && p->symbols != NULL && p->symbols->list != NULL &&
        p->symbols->list(p->symbols->user, 0) != NULL)
        return reject_with_list(p, spot, name);
    return reject_formula(p, spot, "there is no %s %s%s%s%s", is_function ? "function" : "name",
                          kt_name_quote(name).text, nearest.best != NULL ? "; did you mean '" : "",
                          nearest.best != NULL ? nearest.best : "", nearest.best != NULL ? "'?" : "");
}

/* The table of this name; -1: there is none. */
static int find_table(const kt_parser *p, const char *name) {
    for (int k = 0; p->symbols != NULL && k < p->symbols->table_count; k++)
        if (p->symbols->tables[k].name != NULL && strcmp(p->symbols->tables[k].name, name) == 0)
            return k;
    return -1;
}

static bool parse_call(kt_parser *p, const char *spot, const char *name);

/* Reads a symbol, pi, or a function. If names continue with a hyphen, the longest defined one is taken. */
static bool parse_name(kt_parser *p, bool *is_angle) {
    const char *spot = p->at, *end = skip_name(spot);
    char name[KT_EXPRESSION_NAME_MAX + 1], longer[KT_EXPRESSION_NAME_MAX + 1];
    kt_symbol symbol = {.index = 0}, other;
    bool known = find_formula_name(p, spot, end, name, &symbol);
    for (const char *next = end; *next == '-' && skip_name(next + 1) > next + 1;) {
        next = skip_name(next + 1);
        if (next - spot > KT_EXPRESSION_NAME_MAX)
            break;
        if (find_formula_name(p, spot, next, longer, &other)) {
            known = true;
            symbol = other;
            end = next;
        }
    }
    p->at = end;
    skip_blanks(p);
    if (!known && *p->at == '(')
        return parse_call(p, spot, name);
    *is_angle = known && symbol.is_angle;
    if (known && symbol.is_fixed)
        return put_term(p, (kt_expression_term){.code = KT_OPERATOR_NUMBER,
                                                .number = symbol.number,
                                                .symbol = (int32_t)(spot - p->text) + 1});
    if (known)
        return put_term(p, (kt_expression_term){.code = KT_OPERATOR_SYMBOL, .symbol = symbol.index});
    if (strcmp(name, constant_pi) == 0)
        return put_term(p, (kt_expression_term){.code = KT_OPERATOR_NUMBER, .number = kt_radians(180.0)});
    if (find_table(p, name) >= 0)
        return reject_formula(p, spot, "%s is a table; write its input in parentheses: %s(x)", name, name);
    return reject_undefined(p, spot, name, false);
}

/* ---- the grammar ------------------------------------------------------------------------------------------------- */

static bool parse_condition(kt_parser *p, bool *is_angle);

/* Bounds the recursion: leave() closes each level that this function opens. */
static bool enter_recursion(kt_parser *p) {
    if (++p->depth > KT_EXPRESSION_DEPTH_MAX)
        return reject_formula(p, p->at, "more than %d parentheses, signs or powers within one another",
                              KT_EXPRESSION_DEPTH_MAX);
    return true;
}

static void leave(kt_parser *p) { p->depth--; }

static bool parse_closing(kt_parser *p) {
    char text[KT_NAME_TEXT_SIZE];
    return take_character(p, ')') || reject_formula(p, p->at, "a ')' is missing before %s", found_at(p->at, text));
}

/* After the k-th argument: functions of many arguments are made of operators of two. */
static bool put_function_term(kt_parser *p, kt_operator code, int k, int last) {
    if (code == KT_OPERATOR_CLAMP)
        return k == 0 || put_operator(p, k == 1 ? KT_OPERATOR_MAX : KT_OPERATOR_MIN);
    if (code == KT_OPERATOR_MIN || code == KT_OPERATOR_MAX)
        return k == 0 || put_operator(p, code);
    return k < last || put_operator(p, code);
}

static bool parse_lookup(kt_parser *p, const char *name, int k) {
    const int inputs = p->symbols->tables[k].inputs;
    int count = 0;
    bool is_angle;
    if (!enter_recursion(p))
        return false;
    (void)take_character(p, '(');
    do {
        if (!parse_condition(p, &is_angle))
            return false;
    } while (++count < inputs && take_character(p, ','));
    if (count < inputs || *p->at == ',')
        return reject_formula(p, p->at, "the table %s has %d input%s; %s", name, inputs, inputs > 1 ? "s" : "",
                              count < inputs ? "one is missing" : "remove this one");
    leave(p);
    return put_lookup(p, k) && parse_closing(p);
}

static bool parse_call(kt_parser *p, const char *spot, const char *name) {
    int which = 0, count = 0;
    bool is_angle;
    while (which < FUNCTION_COUNT && strcmp(functions[which].name, name) != 0)
        which++;
    if (which == FUNCTION_COUNT && find_table(p, name) >= 0)
        return parse_lookup(p, name, find_table(p, name));
    if (which == FUNCTION_COUNT)
        return reject_undefined(p, spot, name, true);
    if (!enter_recursion(p))
        return false;
    (void)take_character(p, '(');
    do {
        if (count == functions[which].most)
            return reject_formula(p, p->at, "%s takes %d argument%s; remove this one", name, functions[which].most,
                                  functions[which].most > 1 ? "s" : "");
        if (!parse_condition(p, &is_angle) ||
            !put_function_term(p, functions[which].code, count, functions[which].least - 1))
            return false;
        count++;
    } while (take_character(p, ','));
    if (count < functions[which].least)
        return reject_formula(p, p->at, "%s takes %s%d arguments; %d %s missing", name,
                              functions[which].most > functions[which].least ? "at least " : "", functions[which].least,
                              functions[which].least - count, functions[which].least - count > 1 ? "are" : "is");
    leave(p);
    return parse_closing(p);
}

static bool parse_primary(kt_parser *p, bool *is_angle) {
    char text[KT_NAME_TEXT_SIZE];
    const char *spot = p->at;
    *is_angle = false;
    if (kt_is_digit(*spot) || *spot == '.')
        return parse_number(p, is_angle);
    if (kt_is_letter(*spot))
        return parse_name(p, is_angle);
    if (!take_character(p, '('))
        return reject_formula(p, spot, "a number, a name or a '(' is missing before %s", found_at(spot, text));
    if (!enter_recursion(p) || !parse_condition(p, is_angle))
        return false;
    leave(p);
    return parse_closing(p);
}

/* Signs and a power. The base binds first and the exponent is again a factor, so that -2^2 is -(2^2), 2^-1 is allowed,
 * and 2^3^2 is 2^(3^2). */
static bool parse_factor(kt_parser *p, bool *is_angle) {
    bool exponent;
    const bool negative = *p->at == '-';
    if (take_character(p, '-') || take_character(p, '+')) {
        if (!enter_recursion(p) || !parse_factor(p, is_angle))
            return false;
        leave(p);
        return !negative || put_operator(p, KT_OPERATOR_NEGATE);
    }
    if (!parse_primary(p, is_angle))
        return false;
    if (p->at[0] == '*' && p->at[1] == '*')
        return reject_formula(p, p->at, "write ^ for a power");
    if (!take_character(p, '^'))
        return true;
    *is_angle = false;
    if (!enter_recursion(p) || !parse_factor(p, &exponent))
        return false;
    leave(p);
    return put_operator(p, KT_OPERATOR_POWER);
}

static bool parse_product(kt_parser *p, bool *is_angle) {
    bool other;
    if (!parse_factor(p, is_angle))
        return false;
    for (;;) {
        const bool divides = *p->at == '/';
        if (!take_character(p, '*') && !take_character(p, '/'))
            return true;
        if (!parse_factor(p, &other) || !put_operator(p, divides ? KT_OPERATOR_DIVIDE : KT_OPERATOR_MULTIPLY))
            return false;
        *is_angle = divides ? *is_angle && !other : *is_angle != other;
    }
}

static bool parse_sum(kt_parser *p, bool *is_angle) {
    bool other;
    if (!parse_product(p, is_angle))
        return false;
    for (;;) {
        const bool subtracts = *p->at == '-';
        if (!take_character(p, '+') && !take_character(p, '-'))
            return true;
        if (!parse_product(p, &other) || !put_operator(p, subtracts ? KT_OPERATOR_SUBTRACT : KT_OPERATOR_ADD))
            return false;
        *is_angle = *is_angle || other;
    }
}

/* One comparison at most: a < b < c is a fault. The longer signs come first in the list. */
static bool parse_comparison(kt_parser *p, bool *is_angle) {
    static const struct {
        const char *sign;
        kt_operator code;
    } signs[] = {{"<=", KT_OPERATOR_LESS_EQUAL}, {">=", KT_OPERATOR_GREATER_EQUAL}, {"==", KT_OPERATOR_EQUAL},
                 {"!=", KT_OPERATOR_NOT_EQUAL},  {"<", KT_OPERATOR_LESS},           {">", KT_OPERATOR_GREATER}};
    if (!parse_sum(p, is_angle))
        return false;
    for (size_t k = 0; k < sizeof signs / sizeof *signs; k++) {
        const size_t length = strlen(signs[k].sign);
        if (strncmp(p->at, signs[k].sign, length) != 0)
            continue;
        p->at += length;
        skip_blanks(p);
        if (!parse_sum(p, is_angle))
            return false;
        *is_angle = false;
        return put_operator(p, signs[k].code);
    }
    return true;
}

/* ---- conditions -------------------------------------------------------------------------------------------------- */

static bool need_condition(kt_parser *p, const char *spot, const char *word) {
    return p->condition || reject_formula(p, spot, "'%s' joins comparisons, and this is a number; write x != 0", word);
}

/* not x is x == 0. */
static bool parse_negation(kt_parser *p, bool *is_angle) {
    char name[KT_EXPRESSION_NAME_MAX + 1];
    kt_symbol symbol;
    const bool is_name = is_word(p, "not") && find_formula_name(p, p->at, p->at + 3, name, &symbol);
    if (is_name || !take_word(p, "not"))
        return parse_comparison(p, is_angle);
    const char *spot = p->at;
    if (!enter_recursion(p) || !parse_negation(p, is_angle) || !need_condition(p, spot, "not"))
        return false;
    leave(p);
    *is_angle = false;
    return put_term(p, (kt_expression_term){.code = KT_OPERATOR_NUMBER}) && put_operator(p, KT_OPERATOR_EQUAL);
}

/* Parts of a condition, joined by a word. */
static bool parse_joined(kt_parser *p, bool *is_angle, const char *word, kt_operator joined,
                         bool (*parse_part)(kt_parser *p, bool *is_angle)) {
    const char *spot = p->at;
    if (!parse_part(p, is_angle))
        return false;
    while (is_word(p, word)) {
        if (!need_condition(p, spot, word) || !take_word(p, word))
            return false;
        spot = p->at;
        if (!parse_part(p, is_angle) || !need_condition(p, spot, word) || !put_operator(p, joined))
            return false;
        p->condition = true;
    }
    return true;
}

/* Conditions are 1 or 0: `and` is their product. */
static bool parse_conjunction(kt_parser *p, bool *is_angle) {
    return parse_joined(p, is_angle, "and", KT_OPERATOR_MULTIPLY, parse_negation);
}

/* `or` is the larger one. */
static bool parse_condition(kt_parser *p, bool *is_angle) {
    return parse_joined(p, is_angle, "or", KT_OPERATOR_MAX, parse_conjunction);
}

/* ---- the whole --------------------------------------------------------------------------------------------------- */

static bool parse_whole(kt_parser *p) {
    char text[KT_NAME_TEXT_SIZE];
    bool is_angle;
    skip_blanks(p);
    if (*p->at == '\0')
        return reject_formula(p, p->at, "the formula is empty");
    if (!parse_condition(p, &is_angle))
        return false;
    p->to->is_angle = is_angle;
    if (*p->at == '\0')
        return true;
    if (*p->at == ')')
        return reject_formula(p, p->at, "this ')' closes no '('; remove it");
    if (*p->at == '=')
        return reject_formula(p, p->at, "write == to compare; a formula has no other =");
    return reject_formula(p, p->at, "an operator is missing before %s", found_at(p->at, text));
}

/* The size has room for one term more than the text has bytes, so that the size of an empty text is not 0. */
size_t kt_expression_size(const char *text) {
    if (text == NULL)
        return 0;
    const size_t length = strlen(text);
    return sizeof(kt_expression) +
           (length < KT_EXPRESSION_LENGTH_MAX ? length + 1 : KT_EXPRESSION_LENGTH_MAX) * sizeof(kt_expression_term);
}

kt_status kt_expression_parse(const char *text, const kt_symbols *symbols, void *memory, size_t size,
                              const kt_expression **expression, int *column, kt_error *error) {
    if (text == NULL || memory == NULL || expression == NULL)
        return kt_error_set(error, KT_ERROR_ARGUMENT, NULL, "text, memory and expression cannot be NULL");
    if (size < kt_expression_size(text) || (uintptr_t)memory % _Alignof(kt_expression) != 0)
        return kt_error_set(error, KT_ERROR_MEMORY, NULL,
                            "the formula takes %lu bytes, aligned as a double; %lu are given",
                            (unsigned long)kt_expression_size(text), (unsigned long)size);
    kt_parser p = {.text = text, .at = text, .symbols = symbols, .to = memory, .spot = text, .error = error};
    *p.to = (kt_expression){.count = 0};
    const bool is_long = strlen(text) > KT_EXPRESSION_LENGTH_MAX;
    const bool done =
        is_long ? reject_formula(&p, text, "a formula has at most %d characters; compute a part of it as a parameter",
                                 KT_EXPRESSION_LENGTH_MAX)
                : parse_whole(&p);
    if (!done) {
        if (column != NULL)
            *column = (int)(p.spot - text) + 1;
        return KT_ERROR_SCENE;
    }
    *expression = p.to;
    return KT_OK;
}
